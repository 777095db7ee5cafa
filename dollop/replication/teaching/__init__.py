"""Teaching in the laboratory: somebody draws a walk, the robot watches it, learns it, and drives it."""
