"""The program on the vehicle: `program` its command line, `service` the bridge itself, `ports` its real-time loop.

`telemetry` samples to readings · `orders` of the ground, how often it may give them, and its motor tests · `flights`
flight orders and the sticks · `link_set` the links · `device_faults` which device is silent · `parameters` the server,
`store` its file, `store_lock` for one program · `ring` the recording on board, `file_server` which offers it.
"""
