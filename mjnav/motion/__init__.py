"""How the robot and people move: pure steps on arrays."""
