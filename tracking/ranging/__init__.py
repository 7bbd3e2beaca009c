"""The ranging protocol: who sends when, and how long it takes."""
