"""What reaches the terminal: no control character, whoever wrote the text."""

import ast
import sys
from pathlib import Path

from tests.validation.commands import Capture, Make, Patch, Run
from validation.harness.console import output, printable, progress_bar, say, summary_text

ROOT = Path(__file__).parents[3]
EVIL = "a\x1b[31mb\x07c\x9bd\u202ee\x7ff\udcffg\rh"
HARMLESS = r"a\x1b[31mb\x07c\x9bd\u202ee\x7ff\udcffg\rh"


def test_control_characters_are_shown_and_not_sent(capsys: Capture) -> None:
    assert printable("peak Fn, t − t_c = 3 µs") == "peak Fn, t − t_c = 3 µs"
    assert printable(EVIL) == HARMLESS
    output(f"one\n{EVIL}\n")
    say(EVIL.replace("\r", " "))
    captured = capsys.readouterr()
    assert captured.out == f"one\n{HARMLESS}\n\n"
    assert captured.err == f"fingertap: {HARMLESS.replace(chr(92) + 'r', ' ')}\n"


def test_keys_values_and_stored_messages_do_not_reach_the_terminal_raw(
    make_record: Make, tmp_path: Path, fingertap: Run, capsys: Capture
) -> None:
    scene = tmp_path / "scene.toml"
    text = (ROOT / "validation" / "scenes" / "soft.toml").read_text()
    for more in ('"x\\u001b[31my" = 1\n', 'x = "\\u001b[31m"\n'):
        scene.write_text(more + text)
        for arguments in ([str(scene)], ["soft", "--set", "sur\x1b[31m.x=3"], ["so\x1b[31m"]):
            ended = fingertap("run", *arguments, "--model", "hcm")
            assert ended.code != 0
            assert (ended.err + ended.out).replace("\n", "").isprintable()
    output(summary_text(make_record(variant=EVIL[:5])))
    assert "\x1b" not in capsys.readouterr().out


def test_a_bar_shows_titles_as_they_are(monkeypatch: Patch) -> None:
    """Neither control characters nor the markup that `rich` reads."""
    written = []

    class Terminal:
        encoding = "utf-8"

        def isatty(self) -> bool:
            return True

        def write(self, text: str) -> int:
            written.append(text)
            return len(text)

        def flush(self) -> None:
            pass

    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setenv("TERM", "xterm")
    with progress_bar("a[/b]\x1b]0;title\x07") as progress:
        progress(0.5, "[/red]\x1b[2J")
    shown = "".join(written)
    assert "a[/b]\\x1b]0;title\\x07" in shown
    assert "\x1b]0;" not in shown


def test_say_survives_a_closed_terminal(monkeypatch: Patch) -> None:
    class Gone:
        def write(self, text: str) -> int:
            raise OSError(5, "Input/output error")

    monkeypatch.setattr(sys, "stderr", Gone())
    say("nobody hears this")


def test_only_the_console_writes_to_the_terminal() -> None:
    found = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "validation").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "print"
    }
    assert found == {"validation/harness/console.py"}
