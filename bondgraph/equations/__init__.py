"""From causal relations to equations, in closed form and as an executable program."""
