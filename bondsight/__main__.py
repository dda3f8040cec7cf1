"""``python -m bondsight``: the command line."""

from bondsight.cli.main import program

if __name__ == "__main__":
    program()
