"""`python -m drone_rl`: the command `drone-rl`."""

from drone_rl.cli.main import main

if __name__ == "__main__":
    main()
