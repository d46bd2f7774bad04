"""The app in a browser: a page, and an app of its own for each browser that opens it.

server    the sockets, the page, and access control
visitors  the requests that are accepted, and the warning that goes with an address
"""
