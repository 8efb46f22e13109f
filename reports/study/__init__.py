"""The study explained: ladders from its code to ours, and a verdict on each of its claims."""
