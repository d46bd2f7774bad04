"""Decide which requests the page accepts: those of a browser that its user sent here, not a stranger's page.

A page on the internet may open a web socket to this computer from a visitor's browser, and may give its own name this
computer's address (DNS rebinding). The first shows in `Origin`, the second in a `Host` name that can be registered.
"""

import ipaddress
from urllib.parse import urlsplit

LOCAL_NAMES = ("localhost", "local", "internal", "lan")
"""Names with these endings are given by this computer, mDNS or a router; no registrar sells them."""


def refusal(host: str, origin: str | None, own: str) -> str:
    """Reason to refuse a request with these headers, "" to accept it; `own` is the host given for the page."""
    name = _name(host)
    if not (_is_local(name) or name == own):
        return (
            f"this page does not answer to the name '{name}'; open it by its address, or by a name in .local"
        )
    if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
        return f"the page of {origin} may not connect here; open http://{host}/ itself"
    return ""


def is_loopback(host: str) -> bool:
    """Whether only this computer reaches the address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def warning(host: str, control: bool) -> str:
    """The warning about an address before it is opened; "" for loopback."""
    if is_loopback(host):
        return ""
    if control:
        return (
            f"anyone who reaches {host} can do from the page all that the crew can: nobody is asked for a password, "
            "and nothing is encrypted"
        )
    return f"anyone who reaches {host} sees all of this: nobody is asked for a password, and nothing is encrypted"


def in_url(address: str) -> str:
    """An address as written in a URL; the wildcard addresses become loopback."""
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
