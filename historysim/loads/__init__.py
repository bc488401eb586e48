"""What happens, and when: events, straight paths, and the schedule of rows."""
