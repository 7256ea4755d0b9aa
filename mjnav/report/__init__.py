"""Pictures and pages for people. Only this folder and `paper` import matplotlib."""
