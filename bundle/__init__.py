"""One archive that installs seatrial where there is no net: `make bundle`, docs/offline.md.

targets    the computers that it is for, as pip and as markers know them
complete   which requirements a folder of wheels does not meet on a target
build      the archive: wheels, sums, what installs them
offline/   what goes into the archive as it is

"""
