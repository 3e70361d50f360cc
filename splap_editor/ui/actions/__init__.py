"""What menus, keys and buttons call, as tables and the code behind them."""
