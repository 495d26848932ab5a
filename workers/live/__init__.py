"""What a watched training shows: the training robots in clips, or the newest policy driving on its own."""
