"""Transport: serial ports, TCP connections and files, with detection of losses and reopening."""
