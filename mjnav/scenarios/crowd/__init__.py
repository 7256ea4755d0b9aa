"""Recorded crowds: people's tracks from a file of somebody's recording, as people of a scene."""
