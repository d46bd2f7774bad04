"""The next dive: what is known of a vehicle (`knowledge`), what a manoeuvre would add to it, and manoeuvres proposed
within limits of time, space, speed and thrust (`propose`), written as a mission (`writing`)."""
