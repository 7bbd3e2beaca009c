"""What cars may do: pure rules, and the process that holds them to it."""
