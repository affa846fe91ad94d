"""What the rails are: the design line, its irregularities, and the track that is laid of both."""
