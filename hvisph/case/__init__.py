"""What a case is: its models, what they must fulfil together, quantities, and the numbers of the material library."""
