"""What people see of sessions: reports, a dashboard in a browser, the essentials in a terminal."""
