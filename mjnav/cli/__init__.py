"""The command line: one file a command, each with HELP, `configure(parser)` and `execute(arguments) -> exit code`."""
