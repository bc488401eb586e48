"""Load events, their schedule, and the straight load paths between them."""
