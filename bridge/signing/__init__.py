"""MAVLink 2 signing: who holds the key is heard, nobody else; a key lies in a file that its owner alone can read."""
