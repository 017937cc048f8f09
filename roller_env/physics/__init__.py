"""How the world moves: contact parameters, named physics settings, the batch stepper."""
