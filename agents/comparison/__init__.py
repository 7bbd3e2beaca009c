"""Controllers and policies compared: the same seeds, many scenarios, what each of them sees."""
