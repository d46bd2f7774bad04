"""The next dive: what is known of a vehicle (`knowledge`), what a manoeuvre would add to it, and the manoeuvres that are
proposed within limits of time, space, speed and thrust (`propose`), written as a mission (`writing`)."""
