"""Learning in object frames: which object does each place of a task follow? (Sec. IV-B and V, and beyond)."""
