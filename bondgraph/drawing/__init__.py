"""Parts of the drawing of bond graphs: geometry, labels, layout, routing, paint."""
