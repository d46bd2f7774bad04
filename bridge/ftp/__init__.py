"""MAVLink FTP: its packets, and a server from which the ground reads the vehicle's own recording."""
