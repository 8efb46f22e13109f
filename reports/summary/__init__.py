"""What a run says in sentences: who is fastest, what is doubtful, and how it was made."""
