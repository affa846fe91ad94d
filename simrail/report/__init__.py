"""What a person looks at: pages, figures, tables and sentences, made from scores alone."""
