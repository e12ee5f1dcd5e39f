"""What is kept of a session: records, recordings, replay and summary."""
