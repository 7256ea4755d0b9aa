"""What a robot that knew the true paths of all people could have done."""
