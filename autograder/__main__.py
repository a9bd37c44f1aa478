"""The program `autograder`."""

import signal


def main() -> None:
    """Load the command line and run it; Ctrl-C ends the program without a traceback while its packages load, too."""
    if by_default := signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from autograder import cli

    if by_default:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    cli.main()


if __name__ == "__main__":
    main()
