"""Whose requests the page takes: those of a browser that was sent here by its user, not by a stranger's page.

A page of the net may open a web socket to this computer from the browser of whoever looks at it, and may give its own
name this computer's address (DNS rebinding). The first is told by `Origin`, the second by a `Host` that can be bought.
"""

import ipaddress
from urllib.parse import urlsplit

LOCAL_NAMES = ("localhost", "local", "internal", "lan")
"""Names that end so are given by this computer, mDNS or a router, and to nobody by a registrar."""


def refusal(host: str, origin: str | None, own: str) -> str:
    """Why a request with these headers is not taken, "" where it is; `own` is the host that the page was told."""
    name = _name(host)
    if not (_is_local(name) or name == own):
        return (
            f"this page does not answer to the name '{name}'; open it by its address, or by a name in .local"
        )
    if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
        return f"the page of {origin} may not connect here; open http://{host}/ itself"
    return ""


def is_loopback(host: str) -> bool:
    """Whether only this computer reaches it."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def warning(host: str, control: bool) -> str:
    """What has to be said of an address before it is opened; "" for loopback."""
    if is_loopback(host):
        return ""
    if control:
        return (
            f"anyone who reaches {host} can do from the page all that the crew can: nobody is asked for a password, "
            "and nothing is encrypted"
        )
    return f"anyone who reaches {host} sees all of this: nobody is asked for a password, and nothing is encrypted"


def in_url(address: str) -> str:
    """An address as it stands in a URL; one that means all of this computer's is opened by loopback here."""
    if address in ("0.0.0.0", "::"):
        return "127.0.0.1" if address == "0.0.0.0" else "[::1]"
    return f"[{address}]" if ":" in address else address


def _name(host: str) -> str:
    """A `Host` header without its port."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _is_local(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return bool(name) and ("." not in name or name.rpartition(".")[2] in LOCAL_NAMES)
    return True
