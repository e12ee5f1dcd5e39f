"""The operator's station: two arms that lead those of an avatar, and give back what they feel."""
