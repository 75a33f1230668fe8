"""From what an instrument shows to a tip temperature: power law, knee, transfer to a medium."""
