"""The result folder of a run: rows and how they are checked when read, packed runs, parts of a run."""
