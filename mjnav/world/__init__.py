"""The world: MuJoCo or plain kinematics, walking people, sensors and actuation with their noise."""
