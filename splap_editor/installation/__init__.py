"""What the program needs from the system it is started on, and what it leaves there: checked, told, put right."""
