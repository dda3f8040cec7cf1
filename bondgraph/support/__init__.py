"""What every package needs: errors, scalar functions, compiled C, files written whole, archives."""
