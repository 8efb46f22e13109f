"""The habits of the study's own code, kept to show what each of them costs."""
