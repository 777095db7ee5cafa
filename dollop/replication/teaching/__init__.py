"""Teaching in the laboratory: somebody draws a walk; the robot watches, learns and drives it."""
