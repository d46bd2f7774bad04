"""The app in a browser: a page, and an app of its own for each browser that opens it."""
