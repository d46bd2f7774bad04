"""The ground station: records, keeps the parameters, checks the vehicle; no identification.

`recording` links to files · `dives` dive folders · `fetch` the vehicle's own recording · `watch` the vehicle now ·
`monitor` how far a vehicle is off its model · `doctor` checks · `params` files, plan, upload, roll back ·
`feedforward` switched · `flying` a plan that the vehicle flies · `mavproxy` all of this inside MAVProxy.

`peers` who speaks on the links · `sequences` of their numbers and boot clocks · `fleet` which vehicle orders go to
· `asking` questions that wait for an answer · `locks` between programs · `job` work in processes of its own · `applet`
the feed-forward inside ArduSub · `simulated` the simulated vehicle seen from the ground · `bell` rings for alarms.
"""
