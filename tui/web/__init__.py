"""The app in a browser: a page, and an app of its own for each browser that opens it.

server    the sockets, the page, and who may connect
visitors  whose requests are taken, and the warning that goes with an address

"""
