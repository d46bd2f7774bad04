"""An archive that installs seatrial without a network: `make bundle`, docs/offline.md.

targets    the computers to install on, as pip and markers name them
complete   the requirements that a folder of wheels does not meet on a target
build      the archive: wheels, checksums, installer
offline/   files that go into the archive unchanged

"""
