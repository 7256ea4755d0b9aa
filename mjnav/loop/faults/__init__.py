"""What stops an episode: an exception, a tick that hangs, a process that dies."""
