"""The run itself: turn after turn, each judged and stored."""
