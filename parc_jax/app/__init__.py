"""The user's side: files, figures, pages, studies, the shell."""
