"""MAVLink 2 signing: only senders with the key are heard; a key is in a file that only its owner can read."""
