"""Streams of real nodes into the tracker, and policies onto real cars.

    nodes -> links -> decoders -> identity, clocks, plausibility -> live -> policy
    cars  <- links <- drivers  <- safety (a process of its own)  <-

`config`
    swarm.toml: who is in the group, where bytes come from, what may be done.
`links`
    Serial ports and TCP: bytes with the time at which they came.
`decoders`, `readings`, `wire`
    Bytes of devices to what they said, in SI units; the format of our own nodes, and its C header.
`identity`, `clocks`, `plausibility`
    Who said it, when, and whether it can be.
`ingest`, `external_tracker`
    Readings to measurements of nodes; positions from another tracker.
`live`
    Trackers of a swarm, the environment on real cars, the start of a drive.
`drivers`
    Speed and steering to bytes of motor controllers.
`safety`
    The gate that every command passes, and the process that holds the cars.
`recording`, `exports`
    Every byte on disk, and runs in the formats of others.
`emulator`
    The other end: nodes and cars behind ports, and what goes wrong with them.

Host time is nanoseconds of a monotonic clock and always an argument; only what owns a port or a
process reads one. Errors that a user can mend are `errors.BridgeError`.
docs/explanation/architecture.md has the picture.
"""
