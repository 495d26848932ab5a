/** Text that people have written, as Markdown; whatever HTML it holds is left out. */
import ReactMarkdown from 'react-markdown'
import rehypeSanitize from 'rehype-sanitize'
import remarkGfm from 'remark-gfm'
import classes from './workbench.module.css'

export function Markdown({ text }: { text: string }) {
  return (
    <div className={classes.notes}>
      <ReactMarkdown remarkPlugins={[remarkGfm]} rehypePlugins={[rehypeSanitize]}>
        {text}
      </ReactMarkdown>
    </div>
  )
}
