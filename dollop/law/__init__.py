"""What a control law does between its subgoals: the line it keeps to, and when (beyond the paper)."""
