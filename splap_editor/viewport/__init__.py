"""What is drawn and what is under the cursor, on VTK alone."""
