"""A client of the observers' stream: states of a session that runs elsewhere. Python's own library and numpy."""

import http.client
import json
import urllib.parse

import numpy as np

from ._taut import TautError

FORMAT = 1
"""Of the lines; a server of another one has other fields."""
SILENCE = 10.0
"""Seconds without a line after which the server is taken for lost: it sends one a second at least."""
LONGEST_LINE = 1 << 20
"""Bytes; a state has some thousand."""
LONGEST_REFUSAL = 400
"""Bytes of the server's own sentence that a message repeats."""


class watch:  # lower case: a call to those who use it
    """States, one after the other as they come, until the session ends. `hello` says whose they are."""

    def __init__(self, url, token=None):
        self.url = url
        self._connection, self._answer = _connection(url), None
        headers = {"Authorization": f"Bearer {token}"} if token is not None else {}
        try:
            self._answer = self._asked(headers)
            self.hello = self._first()
        except BaseException:
            self.close()
            raise

    def __iter__(self):
        return self

    def __next__(self):
        while (line := self._line()) is not None:
            if line.get("type") == "state":
                return _arrays(line)
        self.close()
        raise StopIteration

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Leaves. Iterating ends."""
        if self._answer is not None:
            self._answer.close()
        self._answer = None
        self._connection.close()

    def _asked(self, headers):
        try:
            self._connection.request("GET", "/stream", headers=headers)
            answer = self._connection.getresponse()
            if answer.status != 200:
                why = answer.read(LONGEST_REFUSAL).decode(errors="replace").strip()
                raise TautError(f"{self.url}: refused with {answer.status} {answer.reason}: {why}")
        except TautError:
            raise
        except ValueError as error:
            raise TautError(f"{self.url}: the token has characters that no header can carry; give the text of the token file") from error
        except (OSError, http.client.HTTPException) as error:
            raise TautError(
                f"{self.url}: nobody answers as a workbench does ({error or type(error).__name__}); is taut serve running there with `enabled = true` in [observers], and is this its port?"
            ) from error
        return answer

    def _first(self):
        hello = self._line() or {}
        if hello.get("type") != "hello" or hello.get("format") != FORMAT:
            found = f"format {hello['format']}" if "format" in hello else "no hello"
            raise TautError(f"{self.url}: {found} where a stream of format {FORMAT} begins; use the wheel of the server's version")
        return _arrays(hello)

    def _line(self):
        """The next line; `None` at the end."""
        if self._answer is None:
            return None
        try:
            text = self._answer.readline(LONGEST_LINE)
            if not text.endswith(b"\n"):
                if len(text) < LONGEST_LINE:
                    return None  # the session ended; half a line is none
                raise ValueError("a line that does not end")
            line = json.loads(text)
            if not isinstance(line, dict):
                raise ValueError("a line that is no object")
        except TimeoutError as error:
            self.close()
            raise TautError(f"{self.url}: no state for {SILENCE:g} s; is the network, or the server, still there?") from error
        except (OSError, http.client.HTTPException) as error:
            self.close()
            raise TautError(f"{self.url}: the connection broke ({error}); a reader that takes nothing for 5 s is disconnected") from error
        except ValueError as error:
            self.close()
            raise TautError(f"{self.url}: not the lines of a workbench ({error}); is this its port?") from error
        return line


def _connection(url):
    wanted = f"{url}: name the observers' port as http://HOST:PORT"
    try:
        parts = urllib.parse.urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise TautError(f"{wanted} ({error})") from error
    if parts.scheme != "http" or not host or parts.path not in ("", "/", "/stream") or parts.query:
        raise TautError(wanted)
    # No proxy and no redirection: a token goes to this address alone.
    return http.client.HTTPConnection(host, port, timeout=SILENCE)


def _arrays(value):
    """`p` and `q` become one pose, `x y z qw qx qy qz`; other rows of floating numbers become arrays."""
    if isinstance(value, dict):
        value = {name: _arrays(part) for name, part in value.items()}
        if set(value) == {"p", "q"}:
            return np.concatenate([value["p"], value["q"]])
        if "p" in value and "q" in value:
            value["pose"] = np.concatenate([value.pop("p"), value.pop("q")])
        return value
    if isinstance(value, list):
        if value and all(part is None or isinstance(part, float) for part in value):
            return np.array(value, dtype=float)  # JSON has no NaN: null
        return [_arrays(part) for part in value]
    return value
