"""One page that shows a run, or several side by side: verdict, player, measures, health, set-up. No network needed."""
