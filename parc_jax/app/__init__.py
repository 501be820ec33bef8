"""What people use: files, figures, pages, studies, the shell."""
