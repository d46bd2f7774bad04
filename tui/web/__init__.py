"""The app in a browser: `server` gives a page, and an app of its own to each browser that opens it."""
