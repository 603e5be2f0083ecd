"""The finger as a chain of rigid bodies, and the true body that its elements stand for."""
