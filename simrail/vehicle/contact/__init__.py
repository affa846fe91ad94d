"""Where wheel and rail touch: profiles, contact geometry, normal and creep forces."""
