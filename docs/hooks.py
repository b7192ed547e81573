"""Pages of the site that have their home elsewhere: README, keys, changes, the command's help."""

from pathlib import Path

from mkdocs.structure.files import File

from dustfall.cli import parser

ROOT = Path(__file__).resolve().parents[1]

PAGES = {
    "index.md": "README.md",
    "configuration.md": "config/README.md",
    "changes.md": "CHANGELOG.md",
    "contribute.md": "CONTRIBUTING.md",
}

LINKS = {
    "](docs/": "](",
    "](config/README.md": "](configuration.md",
    "](CONTRIBUTING.md": "](contribute.md",
    "](CHANGELOG.md": "](changes.md",
}
"""What leads to a page in the repository, and on the site."""


def on_files(files, config):
    """Add the pages, with their links turned to where the site has what they lead to."""
    for page, source in PAGES.items():
        content = (ROOT / source).read_text(encoding="utf-8")
        for there, here in LINKS.items():
            content = content.replace(there, here)
        files.append(File.generated(config, page, content=content))
    files.append(File.generated(config, "commands.md", content=commands()))
    return files


def commands() -> str:
    """The help of the command and of each subcommand."""
    whole = parser()
    (subparsers,) = (action.choices for action in whole._actions if action.dest == "subcommand")
    parts = ["# Command line", f"```text\n{whole.format_help()}```"]
    for name, subparser in subparsers.items():
        parts += [f"## dustfall {name}", f"```text\n{subparser.format_help()}```"]
    return "\n\n".join(parts) + "\n"
