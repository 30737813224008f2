"""Where the command `bh` begins, so small that next to nothing comes before it heeds Ctrl-C.

Until the command line is looked at, an interrupt ends the process at once: an exception would pass through half-read
modules, some of which make another error of it. Importing this module does nothing.
"""

import sys


def main() -> int:
    """Run the command line of this process.

    Returns:
        The exit code, as `bh.commands.cli.main`.
    """
    try:
        import signal

        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not so behind `nohup` and `&`
            signal.signal(signal.SIGINT, _interrupted)
    except KeyboardInterrupt:
        _interrupted()
    from bh.commands.cli import main as command

    return command()


def _interrupted(*_: object) -> None:
    import os

    os.write(2, b"bh: interrupted\n")
    os._exit(130)


if __name__ == "__main__":
    sys.exit(main())
