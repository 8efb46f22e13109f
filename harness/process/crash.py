"""Finds the reason that a program that died gave on standard error: with a stack trace it is not the last line."""

import re

# What begins a line of each language, or of its tools, when a program dies. The group is the reason.
_SIGNS = (
    r"thread '.*' (?:\(\d+\) )?(?P<rust>panicked at .*(?:\n(?!note: |stack backtrace:).*)*)",
    r"(?P<go>(?:panic|fatal error): .*)(?:\n.*)?\n(?:\[signal .*\n)?\n?goroutine ",
    r"(?P<cpp>terminate called after throwing an instance of .*(?:\n  what\(\): .*)?)",
    r"(?P<sanitizer>(?:==\d+==\s*)?ERROR: \w+Sanitizer: .*)",
    r"(?P<undefined>.*: runtime error: .*)",
    r"(?P<assertion>.*: Assertion .* failed\.)",
    r"Exception in thread \".*\" (?P<java>.*)",
    r"Unhandled exception\. (?P<dotnet>.*)",
    r"(?P<javascript>\w*(?:Error|Exception): .*)\n\s+at ",
    r"thread \d+ (?P<zig>panic: .*)",
    r"(?P<fortran>(?:Fortran runtime error:|ERROR STOP) .*)",
    r"ERROR: (?P<julia>.*)\nStacktrace:",
    r"(?P<haskell>.*)\nCallStack \(from HasCallStack\):",
    r"(?P<ocaml>Fatal error: exception .*)",
    r"(?P<lua>.*)\nstack traceback:",
)
_SIGN = re.compile("|".join(f"(?:^{sign})" for sign in _SIGNS), re.MULTILINE)
_LINE = 1000  # characters of a line that are looked at: some signs take time of its length squared
_TRACEBACK = "Traceback (most recent call last):\n"


def reason(text: str) -> str:
    """Returns why a program died, from the text that it wrote to standard error; "" if that is blank.

    The first panic, exception or finding of a sanitizer, which is what later ones follow from; else the exception of
    Python's last traceback; else the last line.
    """
    text = "\n".join(line[:_LINE] for line in text.split("\n"))
    if match := _SIGN.search(text):
        return match[match.lastgroup].strip()
    _, traceback, after = text.rpartition(_TRACEBACK)
    lines = [line for line in after.splitlines() if line.strip()]
    message = next((lines[n:] for n, line in enumerate(lines) if traceback and not line[0].isspace()), lines[-1:])
    return "\n".join(message).strip()
