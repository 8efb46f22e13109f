"""What each part of a scene is worth to its picture: tables, charts and sheets."""
