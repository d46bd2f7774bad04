"""Recording of links.

`link` a link that is opened again · `recorder` frames to files, as they arrive · `files` the present file and the next
· `hub` serves other programs on this computer · `state` what a running recording says of itself · `orders` next dive,
end · `silence` the longest silence of the vehicle.
"""
