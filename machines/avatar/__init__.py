"""The avatar: two arms that follow those of an operator, and tell what they feel."""
