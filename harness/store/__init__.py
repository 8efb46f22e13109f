"""The result folder of a run: its rows, how they are checked when read, packed runs, parts of a run."""
